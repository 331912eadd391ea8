# Builds the Debian package of Selvedge and installs it into an image that runs the service as the user "selvedge":
#
#     docker build -t selvedge .
#     docker run -d --name selvedge --network host -v selvedge-data:/var/lib/selvedge selvedge
#
# The service then listens on 127.0.0.1:7878 of the machine. docs/operating.md says how others may reach it.

FROM debian:12 AS build
WORKDIR /src
# the packages alone first: this layer is kept while the sources change
COPY config/install-dependencies config/install-dependencies
RUN ./config/install-dependencies package \
    && rm -rf /var/lib/apt/lists/*
COPY . .
# the list of files comes from git, which the package is made from
RUN apt-get update \
    && apt-get install -y --no-install-recommends git \
    && git config --global --add safe.directory /src \
    && make deb WITHOUT_DEPS=1 \
    && cp "build/deb/selvedge_$(sed -n 's/^#define SELVEDGE_VERSION "\(.*\)"/\1/p' base/version.h)_$(dpkg --print-architecture).deb" /selvedge.deb

FROM debian:12-slim
COPY --from=build /selvedge.deb /tmp/selvedge.deb
RUN apt-get update \
    && apt-get install -y --no-install-recommends /tmp/selvedge.deb ca-certificates \
    && rm -rf /var/lib/apt/lists/* /tmp/selvedge.deb \
    && { getent passwd selvedge >/dev/null \
         || useradd --system --home-dir /var/lib/selvedge --shell /usr/sbin/nologin selvedge; } \
    && install -d -o selvedge -g selvedge -m 700 /var/lib/selvedge
USER selvedge
VOLUME /var/lib/selvedge
EXPOSE 7878
STOPSIGNAL SIGTERM
ENTRYPOINT ["/usr/bin/selvedged"]
CMD ["--config", "/etc/selvedge/selvedge.conf", "--data", "/var/lib/selvedge"]
