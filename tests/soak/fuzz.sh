#!/usr/bin/env bash
# Made-up requests to every operation of the document, for so long:  tests/soak/fuzz.sh PROGRAM [SECONDS] [SEED]
set -euo pipefail
. "$(dirname "$0")/server.sh"
start_server "$1"
/usr/bin/python3 "$(dirname "$0")/../server/fuzz_api.py" "$url" --examples 40 --seconds "${2:-600}" --seed "${3:-1}" || { tail -n 5 "$work/log"; exit 1; }
