# Sourced by the scripts here: `start_server PROGRAM [ARGUMENTS]` on a free port of loopback with a scratch data folder; sets url and work.
work=$(mktemp -d)
server=""
stop_server() {
  if [ -n "$server" ]; then kill "$server" 2>/dev/null || true; wait "$server" 2>/dev/null || true; fi
  rm -rf "$work"
}
trap stop_server EXIT
start_server() {
  local program=$1
  shift
  "$program" serve --data "$work/data" --listen 127.0.0.1:0 --json --log error "$@" >"$work/address" 2>"$work/log" &
  server=$!
  for _ in $(seq 300); do
    url=$(sed -n 's/.*"url":"\([^"]*\)".*/\1/p' "$work/address")
    [ -z "$url" ] || return 0
    kill -0 "$server" 2>/dev/null || break
    sleep 0.1
  done
  cat "$work/log" >&2
  echo "the service does not start" >&2
  exit 1
}
