#!/usr/bin/env bash
# Registers the same pairs with Kinevox and with tools that anyone can install, and writes one table. See README.md.
#   tests/bench/peers/run.sh --work DIR [--kinevox PROGRAM] [--pair FOLDER:SCAN ...] [--tools a,b] [--start nothing,vbd]
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
work=
arguments=("$@")
while [ $# -gt 0 ]; do
  case $1 in --work) work=${2:-}; shift ;; --work=*) work=${1#--work=} ;; esac
  shift
done
[ -n "$work" ] || { echo "say where to work: run.sh --work DIR" >&2; exit 2; }
for program in elastix transformix plastimatch; do
  command -v "$program" >/dev/null || echo "$program is not there, and is left out: apt-get install elastix plastimatch" >&2
done
mkdir -p "$work"
venv=${KVX_PEERS_VENV:-$work/venv}
if ! "$venv/bin/python" -c 'import ants, itk, picsl_greedy, SimpleITK, scipy' 2>/dev/null; then
  python3 -m venv "$venv"
  "$venv/bin/pip" install --quiet --requirement "$here/requirements.txt"
fi
exec "$venv/bin/python" "$here/peers.py" "${arguments[@]}"
