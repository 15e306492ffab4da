//! Kinds of problems: a code, a status and words for each.

use axum::http::StatusCode;

/// Definition of all kinds, a row for each: variant, name, status, title, meaning with advice, and an example of `detail`.
macro_rules! kinds {
    ($($kind:ident, $name:literal, $status:ident, $title:literal, $meaning:literal, $example:literal;)*) => {
        /// Kind of a problem; its code never changes, its words may.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum ProblemKind {
            $(#[doc = $meaning] $kind,)*
        }

        impl ProblemKind {
            /// All kinds, in the order of the page that lists them.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// Returns `type` of the problem document: the path of the page that explains the kind.
            pub fn code(self) -> &'static str {
                match self { $(Self::$kind => concat!("/problems/", $name)),* }
            }

            /// Returns the HTTP status of the kind.
            pub fn status(self) -> StatusCode {
                match self { $(Self::$kind => StatusCode::$status),* }
            }

            /// Returns a short title for people, the same for all problems of the kind.
            pub fn title(self) -> &'static str {
                match self { $(Self::$kind => $title),* }
            }

            /// Returns the meaning of the kind, and what to do.
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$kind => $meaning),* }
            }

            /// Returns an example of `detail`.
            pub fn example(self) -> &'static str {
                match self { $(Self::$kind => $example),* }
            }
        }
    };
}

kinds! {
    BadRequest, "bad-request", BAD_REQUEST, "The request is not valid",
        "A header or the request itself cannot be understood. The detail names it; the same request will fail again.",
        "Last-Event-ID must be the id of an event";
    NotJson, "not-json", BAD_REQUEST, "The body is not JSON",
        "The body is not JSON in UTF-8 or UTF-16. The detail names line and column.",
        "expected value at line 3 column 11";
    InvalidDocument, "invalid-document", UNPROCESSABLE_ENTITY, "The document is not valid",
        "The body is JSON, but not a valid job document. Every fault is listed in `errors`, with the JSON pointer of its field and the \
         bound that was broken.",
        "/stop/confidence: must be >= 0.5 and < 1, but is 0.3";
    InvalidParameters, "invalid-parameters", UNPROCESSABLE_ENTITY, "The parameters are not valid",
        "A parameter of the query is unknown or has a bad value. `errors` lists them; `parameter` is the parameter's name.",
        "limit: must be 1 to 500, but is 0";
    InvalidMesh, "invalid-mesh", UNPROCESSABLE_ENTITY, "The mesh is not valid",
        "The uploaded file is not an OBJ file that can be used. The detail names the line.",
        "line 17: a face needs at least three corners";
    InvalidModel, "invalid-model", UNPROCESSABLE_ENTITY, "The model is not valid",
        "The uploaded file is not a Honeybee model (HBJSON) that can be used. The detail names the place.",
        "/rooms/0/faces/3/face_type: unknown variant `Roof`, expected one of `Wall`, `Floor`, `RoofCeiling`, `AirBoundary`";
    InvalidWeather, "invalid-weather", UNPROCESSABLE_ENTITY, "The weather is not valid",
        "The uploaded file is not an EPW or WEA file that can be used. The detail names line and field.",
        "line 17, field 15 (direct normal irradiance): must be a number, but is empty";
    InvalidArray, "invalid-array", UNPROCESSABLE_ENTITY, "The array is not valid",
        "The uploaded file is not an array of NumPy that can be used: two dimensions, float32 or float64, C order, no negative numbers.",
        "the array must have two dimensions";
    KeyReused, "key-reused", UNPROCESSABLE_ENTITY, "The Idempotency-Key was used before",
        "The Idempotency-Key belongs to a job with another document. Use a new key for each new job; repeat a key \
         only with the same document.",
        "the Idempotency-Key belongs to a job with another document; use a new key";
    NotFound, "not-found", NOT_FOUND, "Not found",
        "There is nothing at this path: no such job, mesh, model, weather, array or output, or a job that has not computed anything yet.",
        "there is no such job";
    MethodNotAllowed, "method-not-allowed", METHOD_NOT_ALLOWED, "The method is not allowed",
        "The path exists, but not with this method. The header `Allow` and the detail name the methods that it has.",
        "this path allows GET,HEAD,DELETE";
    Conflict, "conflict", CONFLICT, "Not possible now",
        "What is asked for contradicts the state of the job or file: a finished job cannot be cancelled, a mesh that a waiting or \
         running job uses, or another file that any job uses, cannot be deleted.",
        "the job has ended already (succeeded)";
    TooLarge, "too-large", PAYLOAD_TOO_LARGE, "The body is too large",
        "The body is longer than this path allows. The detail names the limit: `document_bytes` or `mesh_bytes` of the \
         configuration; weather may have 16 MiB, and a list of hours 2.2 MB if that is more than `document_bytes`.",
        "the body may have at most 1048576 bytes on this path, but is longer";
    UnsupportedMediaType, "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "The content type is not supported",
        "The header `Content-Type` is not one that this path takes: application/json for documents, model/obj, text/plain or \
         application/octet-stream for meshes, the last two for weather, and with application/json for models; or `Content-Encoding` names a coding such as gzip, which no path takes.",
        "a document must be sent as application/json";
    Range, "range", RANGE_NOT_SATISFIABLE, "The range is not in the file",
        "The header `Range` asks for bytes beyond the end of the file.",
        "the range lies beyond the end of the file, which has 1234 bytes";
    Timeout, "timeout", REQUEST_TIMEOUT, "The request took too long",
        "The request did not arrive completely, or could not be answered, within `request_seconds` of the \
         configuration (for fluxes of a tube: `flux_seconds`); or an upload was slower than \
         `upload_bytes_per_second`. The detail names the limit. Try again later; split a request that takes too long \
         by itself.",
        "the request did not arrive completely or could not be answered within 30 s (request_seconds of the \
         configuration); try again later";
    TooMany, "too-many", TOO_MANY_REQUESTS, "The client has reached a limit",
        "The configuration limits the connections, event streams, uploads and waiting jobs of each client, which \
         leaves some for others. The detail names the limit. Try again after the seconds in `Retry-After`. A client \
         is an IPv4 address or an IPv6 network; all who come through one proxy are one client.",
        "this client has reached its limit of 64 event streams at the same time; try again later";
    QueueFull, "queue-full", SERVICE_UNAVAILABLE, "The queue is full",
        "The queue has reached its limit of waiting jobs. Post the document again after the seconds in `Retry-After`.",
        "the queue is full with 1000 waiting jobs; try again later";
    Unavailable, "unavailable", SERVICE_UNAVAILABLE, "Not available now",
        "The service is shutting down, busy, or cannot reach its database or disk. Try again after the seconds in \
         `Retry-After`.",
        "the service is shutting down";
    UnknownHost, "unknown-host", MISDIRECTED_REQUEST, "The service does not answer to this host",
        "The header `Host` is not the address of the service. Further names are configured in `allowed_hosts`.",
        "this service answers to its own address and to localhost:8080, not to light.example: to allow this name, add \
         it to allowed_hosts in the configuration";
    CrossSite, "cross-site", FORBIDDEN, "A page of another origin may not do this",
        "A web page of another origin sent a request that changes something. Allowed origins are configured in \
         `cors_origins`.",
        "the request comes from a web page of another origin: to allow it, add the origin to cors_origins in the \
         configuration";
    DamagedArtifact, "damaged-artifact", INTERNAL_SERVER_ERROR, "The stored file is damaged",
        "A stored result is missing or damaged. Post the same document again to compute it anew.",
        "the stored file is missing; post the same document again to compute the file anew";
    Internal, "internal", INTERNAL_SERVER_ERROR, "The service failed",
        "An internal error of the service. Its log has the reason, under the `X-Request-Id` of the answer.",
        "internal error: the log of the service has the reason, under the x-request-id of this answer";
    Http, "http", BAD_REQUEST, "The request failed",
        "The request was refused before the service handled it; the status says why.",
        "URI Too Long";
}

impl ProblemKind {
    /// Returns the last part of the code.
    pub fn name(self) -> &'static str {
        self.code().trim_start_matches("/problems/")
    }
}
