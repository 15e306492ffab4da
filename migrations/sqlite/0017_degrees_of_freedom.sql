-- Degrees of freedom of the relative error of the grids; NULL for passes from before they were kept.
ALTER TABLE passes ADD COLUMN degrees_of_freedom REAL;
