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
    KeyReused, "key-reused", UNPROCESSABLE_ENTITY, "The Idempotency-Key was used before",
        "The Idempotency-Key belongs to a job with another document. Take a new key for each new job; repeat a key only with the same \
         document.",
        "it belongs to a job with another document; take a new key";
    NotFound, "not-found", NOT_FOUND, "Not found",
        "There is nothing at this path: no such job, mesh or output, or a job that has not computed anything yet.",
        "there is no such job";
    MethodNotAllowed, "method-not-allowed", METHOD_NOT_ALLOWED, "The method is not allowed",
        "The path exists, but not with this method. The header `Allow` and the detail name the methods that it has.",
        "this path allows GET,HEAD,DELETE";
    Conflict, "conflict", CONFLICT, "Not possible now",
        "What is asked for contradicts the state of the job or mesh: a finished job cannot be cancelled, a mesh that a waiting or running \
         job uses cannot be deleted.",
        "the job has succeeded";
    TooLarge, "too-large", PAYLOAD_TOO_LARGE, "The body is too large",
        "The body is longer than this path takes. The limits are `document_bytes` and `mesh_bytes` of the configuration.",
        "the body is longer than this path allows";
    UnsupportedMediaType, "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "The content type is not supported",
        "The header `Content-Type` is not one that this path takes: application/json for documents, model/obj, text/plain or \
         application/octet-stream for meshes; or `Content-Encoding` names a coding such as gzip, which no path takes.",
        "a document is sent as application/json";
    Range, "range", RANGE_NOT_SATISFIABLE, "The range is not in the file",
        "The header `Range` asks for bytes beyond the end of the file.",
        "the file has 1234 bytes";
    Timeout, "timeout", REQUEST_TIMEOUT, "The request took too long",
        "The request did not arrive completely, or could not be answered, within `request_seconds` of the configuration, fluxes of \
         a tube within `flux_seconds`; or an upload came more slowly than `upload_bytes_per_second`. The detail names the limit. It may be \
         repeated; what takes too long by itself is to be asked for in parts.",
        "it did not arrive completely or could not be answered within 30 s (request_seconds of the configuration); repeat it later";
    TooMany, "too-many", TOO_MANY_REQUESTS, "The client has as much as one may have",
        "Each client may have so many connections, event streams, uploads and waiting jobs, which leaves some for others. What the \
         detail names is limited by the configuration. Ask again after the seconds that `Retry-After` says. A client is an address, or \
         a network of IPv6; all that come through one proxy are one client.",
        "64 event streams of this client are open, and one client may have no more; try again later";
    QueueFull, "queue-full", SERVICE_UNAVAILABLE, "The queue is full",
        "As many jobs wait as may wait. Post the document again after the seconds that `Retry-After` says.",
        "1000 jobs are waiting; try again later";
    Unavailable, "unavailable", SERVICE_UNAVAILABLE, "Not available now",
        "The service is shutting down, busy, or cannot reach its stores. Ask again after the seconds that `Retry-After` says.",
        "the service is shutting down";
    UnknownHost, "unknown-host", MISDIRECTED_REQUEST, "The service does not answer to this host",
        "The header `Host` is not the address of the service. Further names are configured in `allowed_hosts`.",
        "this service answers at its own address and at localhost:8080";
    CrossSite, "cross-site", FORBIDDEN, "A page elsewhere may not do this",
        "A web page of another origin asked for a change. Origins that may are configured in `cors_origins`.",
        "the request comes from a web page of another origin";
    DamagedArtifact, "damaged-artifact", INTERNAL_SERVER_ERROR, "The stored file is damaged",
        "A result was stored and is missing or changed now. The same document, posted again, gives the same file.",
        "the stored file is missing";
    Internal, "internal", INTERNAL_SERVER_ERROR, "The service failed",
        "A fault of the service. Its log has the reason, under the `X-Request-Id` of the answer.",
        "the log of the service has the reason, under this answer's x-request-id";
    Http, "http", BAD_REQUEST, "The request failed",
        "The request failed before it reached the service proper; the status says how.",
        "URI Too Long";
}

impl ProblemKind {
    /// Returns the last part of the code.
    pub fn name(self) -> &'static str {
        self.code().trim_start_matches("/problems/")
    }
}
