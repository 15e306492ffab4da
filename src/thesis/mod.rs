//! The thesis of A. Schou (DTU 2012), reproduced.
