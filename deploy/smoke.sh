#!/usr/bin/env bash
# Asks a running service for everything that costs little; says what is wrong and exits 1 if something is.
#   deploy/smoke.sh https://kinevox.example      with KINEVOX_TOKEN where it asks for one, KINEVOX_CA for an own authority
set -euo pipefail
url=${1:?usage: smoke.sh URL}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0

# The token goes through a file: arguments are seen by everybody on the machine.
options=(-sS --max-time 30)
[ -z "${KINEVOX_CA:-}" ] || options+=(--cacert "$KINEVOX_CA")
if [ -n "${KINEVOX_TOKEN:-}" ]; then
  (umask 077; printf 'header = "Authorization: Bearer %s"\n' "$KINEVOX_TOKEN" >"$work/auth")
else
  : >"$work/auth"
fi

status() { curl "${options[@]}" -K "$work/auth" -o "$work/body" -D "$work/head" -w '%{http_code}' "$@"; }
expect() {
  local wanted=$1 what=$2 got
  shift 2
  got=$(status "$@") || got=none
  if [ "$got" = "$wanted" ]; then echo "ok    $what"; else
    echo "WRONG $what: $got instead of $wanted"; head -c 300 "$work/body" 2>/dev/null || true; echo; failed=1
  fi
}
field() { sed -n "s/.*\"$1\":\"\([^\"]*\)\".*/\1/p" "$work/body" | head -n 1; }

expect 200 "it lives" "$url/healthz"
expect 200 "it is ready" "$url/readyz"
expect 200 "it describes itself" "$url/openapi.json"
expect 200 "it has a page" "$url/docs"
case $(status "$url/metrics") in
  200) echo "ok    it counts" ;;
  404) echo "note  a proxy keeps /metrics for the machine itself" ;;
  *) expect 200 "it counts" "$url/metrics" ;;
esac
expect 200 "it lists jobs" "$url/v1/jobs?limit=1"
grep -qi '^x-content-type-options: nosniff' "$work/head" || { echo "WRONG no security headers"; failed=1; }
expect 404 "what is not there is a problem document" "$url/v1/models/mdl_none"
grep -q '"type":"urn:kinevox:problem:not-found"' "$work/body" || { echo "WRONG no problem document"; failed=1; }
# As a browser writes it.
origin=$(sed -E 's#^(https?://[^/]*).*#\1#; s#^(https://.*):443$#\1#; s#^(http://.*):80$#\1#' <<<"$url")
expect 201 "a subject can be made, as its own page does" -H "Origin: $origin" "$url/v1/subjects" -d '{"region": "knee", "name": "smoke test"}'
subject=$(field id)
printf 'not a volume' >"$work/a.nii"
expect 400 "a file that is no volume is refused" --data-binary @"$work/a.nii" "$url/v1/subjects/$subject/scans?name=a&filename=a.nii"
got=$(status -X DELETE "$url/v1/subjects/$subject") || got=none
case $got in
  204) echo "ok    the subject is removed" ;;
  403) echo "note  the key may not remove subjects: $subject stays" ;;
  *) echo "WRONG removing the subject: $got"; failed=1 ;;
esac
[ $failed = 0 ] && echo "all is well at $url"
exit $failed
