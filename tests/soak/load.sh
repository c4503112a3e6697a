#!/usr/bin/env bash
# wrk on what clients ask most: a job's status, and a posed volume that the client has already (304). Needs a study to build.
#   tests/soak/load.sh PROGRAM STUDY [SECONDS] [CONNECTIONS]
set -euo pipefail
. "$(dirname "$0")/server.sh"
program=$1 study=$2 seconds=${3:-15} connections=${4:-16}
start_server "$program"
"$program" submit "$study" --server "$url" --wait --json --quiet >"$work/submitted"
id() { sed -n "s/.*\"$1\": *\"\([^\"]*\)\".*/\1/p" "$work/submitted" | head -n 1; }
model=$(id id) job=$(id job)
volume="$url/v1/models/$model/volume?format=nrrd&level=2"
etag=$(curl -s -o /dev/null -D - "$volume" | sed -n 's/^ETag: *\(.*\)\r$/\1/Ip')
run() {
  echo "== $1"
  shift
  wrk -t 2 -c "$connections" -d "${seconds}s" --latency "$@" | grep -E 'Latency|50%|99%|requests in|Requests/sec|Non-2xx|Socket'
}
run "job status, $connections connections" "$url/v1/jobs/$job"
run "cached posed volume, 304, $connections connections" -H "If-None-Match: $etag" "$volume"
run "health, $connections connections" "$url/healthz"
