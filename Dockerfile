# The service in a container: data in the volume /data, port 8080.
#   docker build -t skyduct . && docker run -p 127.0.0.1:8080:8080 -v skyduct:/data skyduct

FROM rust:1.95-slim-bookworm AS build
# a C compiler for SQLite and blake3
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .
# what `skyduct --version` and results say: --build-arg VERSION="$(git describe --tags --always --dirty)"
ARG VERSION=
RUN --mount=type=cache,target=/usr/local/cargo/registry --mount=type=cache,target=/src/target \
    SKYDUCT_VERSION="$VERSION" cargo build --release --locked && cp target/release/skyduct /usr/local/bin/skyduct

FROM debian:bookworm-slim
RUN useradd --uid 10001 --no-create-home --shell /usr/sbin/nologin skyduct \
    && mkdir /data && chown skyduct:skyduct /data
COPY --from=build /usr/local/bin/skyduct /usr/local/bin/skyduct
USER 10001
VOLUME /data
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=5s --start-period=10s CMD ["skyduct", "healthcheck"]
ENTRYPOINT ["skyduct"]
# in a container the service must listen beyond loopback; what `docker run -p` publishes decides who reaches it:
# everybody there can read, start and delete jobs; it answers to addresses and localhost, and to names in SKYDUCT_ALLOWED_HOSTS
CMD ["serve", "--listen", "0.0.0.0:8080", "--insecure", "--data", "/data"]
