#!/usr/bin/env bash
# Installs what Kinevox builds and runs with on Debian 12, and obtains the one header that Debian 12 has too old.
# Does nothing where everything is there. Needs root or sudo only when a package is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  g++ cmake ninja-build ccache python3 curl ca-certificates dpkg-dev xz-utils
  pocl-opencl-icd ocl-icd-opencl-dev opencl-clhpp-headers libeigen3-dev
  libinsighttoolkit5-dev libgdcm-dev libdcmtk-dev nlohmann-json3-dev libsqlite3-dev libsqlitecpp-dev libarchive-dev
  libssl-dev libtbb-dev libcjose-dev libtomlplusplus-dev zlib1g-dev libzstd-dev libpng-dev libnlopt-dev libmeshoptimizer-dev
  libtinygltf-dev libcli11-dev libspdlog-dev libboost-dev libgtest-dev libgmock-dev libbenchmark-dev libvalijson-dev
  python3-jsonschema python3-hypothesis python3-tuspy dicom3tools
)
httplib_sha256=e9112546cbae828180f72c2ae6da4bfd8d15ae38138bd99b898e5e30128acc28
httplib_folder=third_party/cpp-httplib

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi; }

missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | grep -q '^install ok installed$' || echo "$package"
  done
}

install_packages() {
  local missing
  mapfile -t missing < <(missing_packages "$@")
  [ ${#missing[@]} = 0 ] && return
  echo "installing: ${missing[*]}" >&2
  as_root apt-get update -qq
  as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# The first Debian mirror that apt on this machine is set up with.
debian_mirror() {
  grep -rhoE 'https?://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d/ 2>/dev/null |
    tr -d ' ' | sed 's|/*$||' | sed -n 1p || true
}

has_httplib() {
  [ -f "$httplib_folder/httplib.h" ] && echo "$httplib_sha256  $httplib_folder/httplib.h" | sha256sum --check --status
}

# cpp-httplib 0.41.0 from Debian's own source package (see docs/dependencies.md); apt checks the archive's signature.
obtain_httplib() {
  has_httplib && return
  local work mirror
  work=$(mktemp -d)
  trap 'rm -rf "$work"' RETURN
  mirror=$(debian_mirror)
  [ -n "$mirror" ] || { echo "no Debian mirror is set up in /etc/apt; put httplib.h 0.41.0 into $httplib_folder" >&2; exit 1; }
  mkdir -p "$work"/{lists,cache/archives}/partial "$httplib_folder"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror trixie-backports main" >"$work/sources.list"
  local apt=(apt-get -qq -o Dir::Etc::sourcelist="$work/sources.list" -o Dir::Etc::sourceparts=/dev/null
             -o Dir::State::Lists="$work/lists" -o Dir::Cache="$work/cache" -o APT::Sandbox::User=)
  (cd "$work" && "${apt[@]}" update && "${apt[@]}" source --download-only --tar-only cpp-httplib=0.41.0*) >/dev/null 2>&1 ||
    (cd "$work" && "${apt[@]}" source --download-only --tar-only cpp-httplib) >/dev/null
  tar -xJOf "$work"/cpp-httplib_*.orig.tar.xz --wildcards '*/httplib.h' >"$work/httplib.h"
  echo "$httplib_sha256  $work/httplib.h" | sha256sum --check --quiet ||
    { echo "httplib.h is not the version we know; see docs/dependencies.md" >&2; exit 1; }
  mv "$work/httplib.h" "$httplib_folder/httplib.h"
}

# Swagger UI for /docs and a linter for the API's document, pinned by package-lock.json. Without npm, /docs says so.
obtain_api_page() {
  command -v npm >/dev/null || { echo "npm is missing: this build will have no page at /docs" >&2; return; }
  local folder=third_party/api-page
  cmp -s deploy/api-page/package-lock.json "$folder/package-lock.json" && [ -d "$folder/node_modules" ] && return
  rm -rf "$folder" && mkdir -p "$folder" && cp deploy/api-page/{package.json,package-lock.json,.npmrc} "$folder/"
  (cd "$folder" && npm ci --loglevel=error >/dev/null) || { rm -rf "$folder"; echo "npm cannot obtain the page at /docs; building without" >&2; }
}

# Upload clients of others, for tests alone; without them those tests skip with a word.
obtain_foreign_clients() {
  [ -d tests/foreign/node_modules/tus-js-client ] && return
  command -v npm >/dev/null || install_packages nodejs npm
  (cd tests/foreign && npm ci --no-audit --no-fund --silent >/dev/null 2>&1) ||
    echo "tus-js-client could not be installed; the test with it will be skipped" >&2
}

install_packages "${packages[@]}" "$@"
obtain_httplib
obtain_foreign_clients
obtain_api_page
