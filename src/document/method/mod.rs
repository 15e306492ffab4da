//! The method of a job document: a name, or an object with the method's own settings.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::ser::Serializer;
use serde::{Deserialize, Serialize};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{AdditionalProperties, Discriminator, ObjectBuilder, OneOfBuilder, Ref, Schema, Type};
use utoipa::{Number, PartialSchema, ToSchema};

use crate::analytic::jenkins;
use crate::document::Warning;
use crate::document::read::{Misfit, misfit};
use crate::document::schema::{Schemas, camel_case};
use crate::integrator::photon_map::progressive::Radius;
use crate::integrator::{Method, bidirectional, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage};
use crate::plan::MethodRequest;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

/// A pass of the bidirectional method keeps its photons' vertices.
pub const MOST_PHOTONS_THAT_ARE_KEPT: u64 = 1_048_576;

/// The spread of fixed points tells their error.
pub const LEAST_FIXED_POINTS: u32 = 2;

/// How the light is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MethodKind {
    /// The plan picks and says why.
    #[default]
    Auto,
    /// From the sensors and the eye to the light; unbiased. Fluxes of tubes and the balance of energy stay unknown.
    PathTracing,
    /// Paths from both sides, connected everywhere; unbiased.
    BidirectionalPathTracing,
    /// Photon maps of one gather radius with final gathering. The bias of the radius does not shrink with passes; its
    /// estimate is part of the standard error.
    PhotonMapping,
    /// Progressive photon mapping: eye rays and points of cells are the same in every pass; their error is part of the
    /// standard error, as is the estimated bias.
    Ppm,
    /// Stochastic progressive photon mapping: eye rays are new in every pass. The estimated bias is part of the standard
    /// error.
    Sppm,
    LightTracing,
    /// The path cut at a Lambertian diffuser: photons down the tubes, then backward paths in the room; unbiased. Fluxes of
    /// tubes are known, the balance of energy is not.
    TwoStage,
    /// Deterministic, after Kocifaj, Darula and Kittler: tubes without meshes in an empty room, grids only.
    Holigilm,
    /// The semi-empirical formula of Jenkins, Muneer and Kubie, the reflections of a room included; grids only, without
    /// an estimate of the error.
    Jenkins,
}

impl MethodKind {
    pub const ALL: [Self; 10] = [
        Self::Auto,
        Self::PathTracing,
        Self::BidirectionalPathTracing,
        Self::PhotonMapping,
        Self::Ppm,
        Self::Sppm,
        Self::LightTracing,
        Self::TwoStage,
        Self::Holigilm,
        Self::Jenkins,
    ];

    /// Names of the method's own settings.
    pub fn settings(self) -> &'static [&'static str] {
        match self {
            Self::Auto | Self::Holigilm => &[],
            Self::PathTracing => &["samples_per_sensor", "samples_per_pixel"],
            Self::BidirectionalPathTracing | Self::TwoStage => {
                &["photons_per_pass", "samples_per_sensor", "samples_per_pixel"]
            }
            Self::PhotonMapping => &["photons_per_pass", "initial_radius_m", "gather_rays"],
            Self::Ppm => {
                &["photons_per_pass", "initial_radius_m", "alpha", "radius", "samples_per_sensor", "samples_per_pixel"]
            }
            Self::Sppm => &["photons_per_pass", "initial_radius_m", "alpha", "radius"],
            Self::LightTracing => &["photons_per_pass"],
            Self::Jenkins => &["coefficient", "pipe_transmittance", "bend_factor"],
        }
    }

    /// Smallest and largest value of a setting, where they are other than for most methods.
    fn bounds(self, setting: &str) -> (Option<u64>, Option<u64>) {
        match (self, setting) {
            (Self::BidirectionalPathTracing, "photons_per_pass") => (None, Some(MOST_PHOTONS_THAT_ARE_KEPT)),
            (Self::Ppm, "samples_per_sensor" | "samples_per_pixel") => (Some(LEAST_FIXED_POINTS.into()), None),
            _ => (None, None),
        }
    }

    fn name_of_schema() -> String {
        <Self as ToSchema>::name().into_owned()
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::PathTracing => "path_tracing",
            Self::BidirectionalPathTracing => "bidirectional_path_tracing",
            Self::PhotonMapping => "photon_mapping",
            Self::Ppm => "ppm",
            Self::Sppm => "sppm",
            Self::LightTracing => "light_tracing",
            Self::TwoStage => "two_stage",
            Self::Holigilm => "holigilm",
            Self::Jenkins => "jenkins",
        }
    }
}

/// What the gather radius of a pass depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RadiusKind {
    /// The pass' number alone: passes are independent.
    Schedule,
    /// The photons that the sensor or pixel has found in the passes before.
    PerPoint,
}

impl From<RadiusKind> for Radius {
    fn from(kind: RadiusKind) -> Self {
        match kind {
            RadiusKind::Schedule => Self::Schedule,
            RadiusKind::PerPoint => Self::PerPoint,
        }
    }
}

impl From<Radius> for RadiusKind {
    fn from(radius: Radius) -> Self {
        match radius {
            Radius::Schedule => Self::Schedule,
            Radius::PerPoint => Self::PerPoint,
        }
    }
}

/// A method's name, or an object of `kind` and the method's own settings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MethodDocument {
    pub kind: MethodKind,
    /// `None` when the document gives the name alone.
    pub settings: Option<MethodSettings>,
}

/// Settings of the methods; each is of some methods only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MethodSettings {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons_per_pass: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial_radius_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<RadiusKind>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples_per_sensor: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples_per_pixel: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gather_rays: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficient: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pipe_transmittance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend_factor: Option<f64>,
}

impl MethodDocument {
    /// The method with its settings, the defaults filled in.
    pub fn request(&self) -> MethodRequest {
        let settings = self.settings.unwrap_or_default();
        match self.kind {
            MethodKind::Auto => MethodRequest::Auto,
            MethodKind::LightTracing => {
                let default = light_tracing::Settings::default();
                let photons_per_pass = settings.photons_per_pass.unwrap_or(default.photons_per_pass);
                MethodRequest::Method(Method::LightTracing(light_tracing::Settings { photons_per_pass }))
            }
            MethodKind::Ppm => {
                let default = ppm::Settings::default();
                MethodRequest::Method(Method::Ppm(ppm::Settings {
                    photons_per_pass: settings.photons_per_pass.unwrap_or(default.photons_per_pass),
                    initial_radius_m: settings.initial_radius_m.or(default.initial_radius_m),
                    alpha: settings.alpha.unwrap_or(default.alpha),
                    radius: settings.radius.map_or(default.radius, Radius::from),
                    samples_per_sensor: settings.samples_per_sensor.unwrap_or(default.samples_per_sensor),
                    samples_per_pixel: settings.samples_per_pixel.unwrap_or(default.samples_per_pixel),
                }))
            }
            MethodKind::Sppm => {
                let default = sppm::Settings::default();
                MethodRequest::Method(Method::Sppm(sppm::Settings {
                    photons_per_pass: settings.photons_per_pass.unwrap_or(default.photons_per_pass),
                    initial_radius_m: settings.initial_radius_m.or(default.initial_radius_m),
                    alpha: settings.alpha.unwrap_or(default.alpha),
                    radius: settings.radius.map_or(default.radius, Radius::from),
                }))
            }
            MethodKind::PathTracing => {
                let default = path_tracing::Settings::default();
                MethodRequest::Method(Method::PathTracing(path_tracing::Settings {
                    samples_per_sensor: settings.samples_per_sensor.unwrap_or(default.samples_per_sensor),
                    samples_per_pixel: settings.samples_per_pixel.unwrap_or(default.samples_per_pixel),
                }))
            }
            MethodKind::BidirectionalPathTracing => {
                let default = bidirectional::Settings::default();
                MethodRequest::Method(Method::Bidirectional(bidirectional::Settings {
                    photons_per_pass: settings.photons_per_pass.unwrap_or(default.photons_per_pass),
                    samples_per_sensor: settings.samples_per_sensor.unwrap_or(default.samples_per_sensor),
                    samples_per_pixel: settings.samples_per_pixel.unwrap_or(default.samples_per_pixel),
                }))
            }
            MethodKind::PhotonMapping => {
                let default = photon_mapping::Settings::default();
                MethodRequest::Method(Method::PhotonMapping(photon_mapping::Settings {
                    photons_per_pass: settings.photons_per_pass.unwrap_or(default.photons_per_pass),
                    initial_radius_m: settings.initial_radius_m.or(default.initial_radius_m),
                    gather_rays: settings.gather_rays.or(default.gather_rays),
                }))
            }
            MethodKind::TwoStage => {
                let default = two_stage::Settings::default();
                MethodRequest::Method(Method::TwoStage(two_stage::Settings {
                    photons_per_pass: settings.photons_per_pass.unwrap_or(default.photons_per_pass),
                    samples_per_sensor: settings.samples_per_sensor.unwrap_or(default.samples_per_sensor),
                    samples_per_pixel: settings.samples_per_pixel.unwrap_or(default.samples_per_pixel),
                }))
            }
            MethodKind::Holigilm => MethodRequest::Method(Method::Holigilm),
            MethodKind::Jenkins => MethodRequest::Method(Method::Jenkins(jenkins::Settings {
                coefficient: settings.coefficient.unwrap_or(jenkins::COEFFICIENT),
                pipe_transmittance: settings.pipe_transmittance,
                bend_factor: settings.bend_factor,
            })),
        }
    }
}

/// What a reader of a method's results must know of its grids.
pub fn method_warning(method: &Method, kernel: &TraceableScene, grids: &[Grid]) -> Option<Warning> {
    let mirrors = kernel.interreflection && kernel.specular().any(|specular| specular.lobe.is_none());
    let points = grids.iter().any(|grid| grid.estimate == EstimateKind::Point);
    let by_chance = match method {
        Method::PathTracing(_) | Method::TwoStage(_) => mirrors,
        Method::Bidirectional(_) => mirrors && points,
        _ => false,
    };
    if by_chance {
        return Some(Warning {
            code: "mirrors_by_chance".to_owned(),
            detail: format!(
                "{} finds a diffuser or luminaire that a mirror shows to a sensor by chance: as long as few paths have, the \
                 standard error is too small; cell averages by light_tracing or bidirectional_path_tracing do not have \
                 this fault",
                method.name()
            ),
        });
    }
    let Method::Jenkins(settings) = method else { return None };
    let excess = settings.coefficient * std::f64::consts::PI;
    Some(Warning {
        code: "jenkins_flux_excess".to_owned(),
        detail: format!(
            "semi-empirical: over the whole plane the formula gives {excess:.3} times the flux that the tube puts into \
             the room; its coefficient {} was fitted with the reflections of a room in it, and the reflectances of this \
             room do not enter; no estimate of the error exists",
            settings.coefficient
        ),
    })
}

/// A method's own settings as results show them.
pub fn settings_json(method: &Method) -> serde_json::Value {
    match method {
        Method::LightTracing(settings) => {
            serde_json::json!({ "photons_per_pass": settings.photons_per_pass })
        }
        Method::Ppm(settings) => serde_json::json!({
            "photons_per_pass": settings.photons_per_pass,
            "initial_radius_m": settings.initial_radius_m,
            "alpha": settings.alpha,
            "radius": RadiusKind::from(settings.radius),
            "samples_per_sensor": settings.samples_per_sensor,
            "samples_per_pixel": settings.samples_per_pixel,
        }),
        Method::Sppm(settings) => serde_json::json!({
            "photons_per_pass": settings.photons_per_pass,
            "initial_radius_m": settings.initial_radius_m,
            "alpha": settings.alpha,
            "radius": RadiusKind::from(settings.radius),
        }),
        Method::PathTracing(settings) => serde_json::json!({
            "samples_per_sensor": settings.samples_per_sensor,
            "samples_per_pixel": settings.samples_per_pixel,
        }),
        Method::Bidirectional(settings) => serde_json::json!({
            "photons_per_pass": settings.photons_per_pass,
            "samples_per_sensor": settings.samples_per_sensor,
            "samples_per_pixel": settings.samples_per_pixel,
        }),
        Method::PhotonMapping(settings) => serde_json::json!({
            "photons_per_pass": settings.photons_per_pass,
            "initial_radius_m": settings.initial_radius_m,
            "gather_rays": settings.gather_rays,
        }),
        Method::TwoStage(settings) => serde_json::json!({
            "photons_per_pass": settings.photons_per_pass,
            "samples_per_sensor": settings.samples_per_sensor,
            "samples_per_pixel": settings.samples_per_pixel,
        }),
        Method::Holigilm => serde_json::json!({}),
        Method::Jenkins(settings) => serde_json::json!({
            "coefficient": settings.coefficient,
            "pipe_transmittance": settings.pipe_transmittance,
            "bend_factor": settings.bend_factor,
        }),
    }
}

/// The fields of all methods.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = MethodSettings)]
struct RawMethod {
    kind: MethodKind,
    /// Photons emitted per pass, all tubes together; of `light_tracing`, `two_stage`, `bidirectional_path_tracing` (there at
    /// most 1 048 576), `sppm`, `ppm` and `photon_mapping`.
    #[schema(minimum = 64, maximum = 16_777_216u64)]
    photons_per_pass: Option<u64>,
    /// Gather radius of the first pass in metres, > 0; of `sppm`, `ppm` and `photon_mapping`, where it is that of all
    /// passes. Default: a twentieth of the room's shortest edge, with `photon_mapping` a fortieth.
    #[schema(exclusive_minimum = 0, maximum = 10_000)]
    initial_radius_m: Option<f64>,
    /// The squared radius shrinks by (i + alpha) / (i + 1) from pass to pass, or with the radius `per_point` by (N + alpha M)
    /// / (N + M) where N photons were kept and M are found, default 2/3; of `sppm` and `ppm`.
    #[schema(exclusive_minimum = 0, exclusive_maximum = 1)]
    alpha: Option<f64>,
    /// What the gather radius of a pass depends on, default `schedule`; of `sppm` and `ppm`.
    radius: Option<RadiusKind>,
    /// Paths per sensor and pass, default 64, of `path_tracing`, `bidirectional_path_tracing` and `two_stage` (default 256);
    /// fixed points of each cell of cell averages, 2 or more, default 16, of `ppm`.
    #[schema(minimum = 1, maximum = 65_536u64)]
    samples_per_sensor: Option<u32>,
    /// Paths per pixel and pass, default 4, of `path_tracing`, `bidirectional_path_tracing` (default 1) and `two_stage`
    /// (default 8); fixed eye rays of each pixel, 2 or more, default 4, of `ppm`.
    #[schema(minimum = 1, maximum = 4_096u64)]
    samples_per_pixel: Option<u32>,
    /// Final gather rays per pass of each sensor and of each point that a pixel's ray meets, default 256 of a sensor and
    /// 16 of a point; of `photon_mapping`.
    #[schema(minimum = 1, maximum = 65_536u64)]
    gather_rays: Option<u32>,
    /// c of E = c Phi cos^4(theta) / V^2, > 0, default 0.494; 1/pi is a Lambertian disc far away; of `jenkins`.
    #[schema(exclusive_minimum = 0, maximum = 10)]
    coefficient: Option<f64>,
    /// Transmission of a piece of pipe of aspect ratio 1, 0..1; of `jenkins`. Default: the exact transmission of a straight
    /// tube of that aspect ratio and the tube's reflectance, of the daylight of the job.
    #[schema(minimum = 0, maximum = 1)]
    pipe_transmittance: Option<f64>,
    /// Factor per bend, 0..1; of `jenkins`, which needs it for a tube with bends.
    #[schema(minimum = 0, maximum = 1)]
    bend_factor: Option<f64>,
}

impl MethodSettings {
    /// Names of the settings that have a value.
    fn given(&self) -> impl Iterator<Item = &'static str> {
        let given = [
            ("photons_per_pass", self.photons_per_pass.is_some()),
            ("initial_radius_m", self.initial_radius_m.is_some()),
            ("alpha", self.alpha.is_some()),
            ("radius", self.radius.is_some()),
            ("samples_per_sensor", self.samples_per_sensor.is_some()),
            ("samples_per_pixel", self.samples_per_pixel.is_some()),
            ("gather_rays", self.gather_rays.is_some()),
            ("coefficient", self.coefficient.is_some()),
            ("pipe_transmittance", self.pipe_transmittance.is_some()),
            ("bend_factor", self.bend_factor.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(name, _)| name)
    }

    /// Gives absent settings of the method their defaults, those that depend on the scene apart.
    fn fill_in(&mut self, kind: MethodKind) {
        let mut samples = |photons: Option<u64>, per_sensor: u32, per_pixel: u32| {
            self.photons_per_pass = self.photons_per_pass.or(photons);
            self.samples_per_sensor = self.samples_per_sensor.or(Some(per_sensor));
            self.samples_per_pixel = self.samples_per_pixel.or(Some(per_pixel));
        };
        match kind {
            MethodKind::Auto | MethodKind::Holigilm => {}
            MethodKind::PathTracing => {
                let default = path_tracing::Settings::default();
                samples(None, default.samples_per_sensor, default.samples_per_pixel);
            }
            MethodKind::BidirectionalPathTracing => {
                let default = bidirectional::Settings::default();
                samples(Some(default.photons_per_pass), default.samples_per_sensor, default.samples_per_pixel);
            }
            MethodKind::TwoStage => {
                let default = two_stage::Settings::default();
                samples(Some(default.photons_per_pass), default.samples_per_sensor, default.samples_per_pixel);
            }
            MethodKind::Ppm => {
                let default = ppm::Settings::default();
                samples(Some(default.photons_per_pass), default.samples_per_sensor, default.samples_per_pixel);
                self.alpha = self.alpha.or(Some(default.alpha));
                self.radius = self.radius.or(Some(default.radius.into()));
            }
            MethodKind::Sppm => {
                let default = sppm::Settings::default();
                self.photons_per_pass = self.photons_per_pass.or(Some(default.photons_per_pass));
                self.alpha = self.alpha.or(Some(default.alpha));
                self.radius = self.radius.or(Some(default.radius.into()));
            }
            MethodKind::PhotonMapping => {
                let default = photon_mapping::Settings::default();
                self.photons_per_pass = self.photons_per_pass.or(Some(default.photons_per_pass));
            }
            MethodKind::LightTracing => {
                let default = light_tracing::Settings::default();
                self.photons_per_pass = self.photons_per_pass.or(Some(default.photons_per_pass));
            }
            MethodKind::Jenkins => self.coefficient = self.coefficient.or(Some(jenkins::COEFFICIENT)),
        }
    }
}

impl TryFrom<RawMethod> for MethodDocument {
    type Error = Misfit;

    fn try_from(raw: RawMethod) -> Result<Self, Misfit> {
        let kind = raw.kind;
        let RawMethod { photons_per_pass, initial_radius_m, alpha, radius, gather_rays, .. } = raw;
        let RawMethod { samples_per_sensor, samples_per_pixel, coefficient, pipe_transmittance, bend_factor, .. } = raw;
        let mut settings = MethodSettings {
            photons_per_pass,
            initial_radius_m,
            alpha,
            radius,
            samples_per_sensor,
            samples_per_pixel,
            gather_rays,
            coefficient,
            pipe_transmittance,
            bend_factor,
        };
        if let Some(field) = settings.given().find(|field| !kind.settings().contains(field)) {
            return Err(misfit(field, format!("not a field of the method `{}`", kind.name())));
        }
        settings.fill_in(kind);
        Ok(Self { kind, settings: Some(settings) })
    }
}

impl Serialize for MethodDocument {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct WithSettings {
            kind: MethodKind,
            #[serde(flatten)]
            settings: MethodSettings,
        }
        match self.settings {
            None => self.kind.serialize(serializer),
            Some(settings) => WithSettings { kind: self.kind, settings }.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for MethodDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MethodVisitor)
    }
}

struct MethodVisitor;

impl<'de> Visitor<'de> for MethodVisitor {
    type Value = MethodDocument;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("the name of a method or an object with its kind and settings")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<MethodDocument, E> {
        let kind = MethodKind::deserialize(serde::de::value::StrDeserializer::new(name))?;
        Ok(MethodDocument { kind, settings: None })
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MethodDocument, A::Error> {
        RawMethod::deserialize(MapAccessDeserializer::new(map))?.try_into().map_err(A::Error::custom)
    }
}

impl PartialSchema for MethodDocument {
    fn schema() -> RefOr<Schema> {
        OneOfBuilder::new()
            .item(Ref::from_schema_name(MethodKind::name_of_schema()))
            .item(Ref::from_schema_name(WITH_SETTINGS))
            .description(Some("A method's name, or an object of `kind` and the method's own settings."))
            .into()
    }
}

impl ToSchema for MethodDocument {}

const WITH_SETTINGS: &str = "MethodWithSettings";

/// Adds a component for each method with its own settings alone.
pub(in crate::document) fn complete_schema(schemas: &mut Schemas) {
    let RefOr::T(Schema::Object(all)) = RawMethod::schema() else { return };
    let mut discriminator = Discriminator::new("kind");
    let mut one_of = OneOfBuilder::new().description(Some("A method and its own settings."));
    for kind in MethodKind::ALL {
        let mut object = ObjectBuilder::new()
            .property("kind", ObjectBuilder::new().schema_type(Type::String).enum_values(Some([kind.name()])))
            .required("kind")
            .additional_properties(Some(AdditionalProperties::FreeForm(false)));
        for name in kind.settings() {
            let Some(mut setting) = all.properties.get(*name).cloned() else { continue };
            if let RefOr::T(Schema::Object(setting)) = &mut setting {
                let (least, most) = kind.bounds(name);
                setting.minimum = least.map(Number::from).or(setting.minimum.take());
                setting.maximum = most.map(Number::from).or(setting.maximum.take());
            }
            object = object.property(*name, setting);
        }
        let name = camel_case(kind.name()) + "Method";
        let reference = Ref::from_schema_name(&name);
        discriminator.mapping.insert(kind.name().to_owned(), reference.ref_location.clone());
        one_of = one_of.item(reference);
        schemas.insert(name, object.into());
    }
    schemas.insert(WITH_SETTINGS.to_owned(), one_of.discriminator(Some(discriminator)).into());
}
