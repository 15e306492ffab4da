// Types that the page's modules share: the interface's are those generated from openapi.yaml.
type Schemas = import("skyduct-api").components["schemas"];
type JobDocument = Schemas["JobDocument"];
type Tube = Schemas["TubeDocument"];
type ParametricTube = Schemas["ParametricTube"];
type MeshTube = Schemas["MeshTubeDocument"];
type Surface = Schemas["SurfaceDocument"];
type Grid = Schemas["GridResult"];
type Job = Schemas["JobResource"];
type FinishedJob = Schemas["FinishedJob"];
type JobSummary = Schemas["JobSummary"];
type Problem = Schemas["Problem"];
type Mesh = Schemas["MeshResource"];
type Weather = Schemas["WeatherResource"];
type SkyType = Schemas["SkyType"];
type View = Schemas["ViewDocument"];
/** A point of the curve of error against time. */
type Pass = {
  passes: number;
  seconds: number;
  relative_error: number | null;
  /** What the event of a pass foretells. */
  seconds_left?: number | null;
  grids?: Schemas["OutputForecast"] | null;
};
type ErrorHistory = Schemas["ErrorHistory"];
/** A computed document: the job, and its first grid. A stored one has no job in this service. */
type Answer = { job: Job; grid: Grid | null; stored?: true };
type Drawn = import("lit-html").TemplateResult<1> | import("lit-html").TemplateResult<2>;
