#!/usr/bin/env python3
"""Drives every operation of the running service's own document with made-up requests (Hypothesis).

    fuzz_api.py URL [--examples N] [--seed N] [--seconds S]

Fails for a 5xx other than 503, a hang, a dropped connection, or an answer that the document does not describe.
Ids are drawn from what the service has (a subject, scans, a model are made first) and from nonsense.
"""
import argparse
import http.client
import json
import string
import sys
import time
import urllib.parse

import jsonschema
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

TIMEOUT_S = 60
METHODS = ("get", "head", "put", "post", "delete", "options", "patch")
NASTY = ["", " ", "\x00", "../../etc/passwd", "%00", "a" * 5000, "é", "'; DROP TABLE job; --", "null", "-1", "1e999", "NaN", "{}"]


class Service:
    def __init__(self, url):
        parts = urllib.parse.urlsplit(url)
        self.host, self.port = parts.hostname, parts.port
        self.sent = 0
        self.statuses = {}
        self.document = json.loads(self.send("GET", "/openapi.json")[2])

    def send(self, method, target, body=None, headers=None):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=TIMEOUT_S)
        try:
            connection.putrequest(method, target, skip_accept_encoding=True)
            for name, value in (headers or {}).items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            self.sent += 1
            self.statuses[answer.status] = self.statuses.get(answer.status, 0) + 1
            if answer.getheader("Content-Type", "").startswith("text/event-stream"):
                return answer.status, answer.headers, b""  # a stream ends with its job
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def post(self, path, body, content_type="application/json"):
        status, _, text = self.send("POST", path, body, {"Content-Type": content_type})
        if status not in (201, 202):
            raise SystemExit(f"{path} answered {status}: {text[:300]!r}")
        return json.loads(text)


def resolve(document, node):
    while "$ref" in node:
        found = document
        for part in node["$ref"].lstrip("#/").split("/"):
            found = found[part.replace("~1", "/").replace("~0", "~")]
        node = found
    return node


def check_answer(service, operation, label, answer):
    status, headers, body = answer
    assert status < 500 or status == 503, f"{label} answered {status}: {body[:300]!r}"
    responses = operation["responses"]
    assert str(status) in responses or (status >= 400 and "default" in responses), f"{label}: status {status} is not described"
    described = resolve(service.document, responses.get(str(status), responses.get("default")))
    if not body:
        return
    media = headers.get("Content-Type", "").split(";")[0]
    assert media in described.get("content", {}), f"{label} {status}: media type {media!r} is not described"
    if "json" in media:
        schema = dict(described["content"][media].get("schema", {}), components=service.document["components"])
        jsonschema.Draft202012Validator(schema).validate(json.loads(body))


def text_strategy():
    return st.one_of(st.sampled_from(NASTY), st.text(alphabet=string.printable, max_size=40), st.text(max_size=20))


def value_strategy(document, schema, ids):
    schema = resolve(document, schema)
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else list(kinds)
    good = []
    if "const" in schema:
        good.append(st.just(schema["const"]))
    if "enum" in schema:
        good.append(st.sampled_from(schema["enum"]))
    if "object" in kinds:
        fields = {name: value_strategy(document, one, ids) for name, one in schema.get("properties", {}).items()}
        needed = {name: fields[name] for name in schema.get("required", []) if name in fields}
        rest = {name: one for name, one in fields.items() if name not in needed}
        good.append(st.fixed_dictionaries(needed, optional=rest))
    if "array" in kinds:
        good.append(st.lists(value_strategy(document, schema.get("items", {}), ids), max_size=4))
    if "integer" in kinds:
        good.append(st.integers(min_value=-(2**70), max_value=2**70))
    if "number" in kinds:
        good.append(st.floats())
    if "boolean" in kinds:
        good.append(st.booleans())
    if "string" in kinds and "enum" not in schema:
        good.append(st.one_of(st.sampled_from(ids), text_strategy()))
    anything = st.recursive(st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), text_strategy()),
                            lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(text_strategy(), inner, max_size=3)),
                            max_leaves=6)
    return st.one_of(*good, anything) if good else anything


def as_text(value):
    return value if isinstance(value, str) else json.dumps(value)


def quoted(value, safe=""):
    return urllib.parse.quote(as_text(value).encode("utf-8", "replace"), safe=safe)


def header_safe(value):
    return "".join(c for c in as_text(value) if " " <= c <= "~")[:2000]


def body_strategy(document, operation, ids):
    content = operation.get("requestBody", {}).get("content", {})
    choices = [st.tuples(st.sampled_from(list(content) or ["application/json"]), st.binary(max_size=300))]
    for media, described in content.items():
        if "json" in media:
            values = value_strategy(document, described.get("schema", {}), ids).map(lambda v: json.dumps(v).encode("utf-8", "replace"))
            choices.append(st.tuples(st.just(media), values))
        for example in described.get("examples", {}).values():
            text = example["value"] if isinstance(example["value"], str) else json.dumps(example["value"])
            choices.append(st.tuples(st.just(media), st.just(text.encode())))
    return st.one_of(*choices)


def request_strategy(service, path, method, operation, ids):
    document = service.document
    parameters = [resolve(document, one) for one in operation.get("parameters", [])]

    @st.composite
    def make(draw):
        target, query, headers = path, [], {}
        for one in parameters:
            wanted = one.get("required", False) or draw(st.booleans())
            if not wanted:
                continue
            value = draw(value_strategy(document, one.get("schema", {}), ids))
            if "example" in one and draw(st.booleans()):
                value = one["example"]
            if one["in"] == "path":
                target = target.replace("{" + one["name"] + "}", quoted(value) or "x")
            elif one["in"] == "query" and isinstance(value, dict):
                query += [quoted(name) + "=" + quoted(item) for name, item in value.items()]
            elif one["in"] == "query":
                query.append(quoted(one["name"]) + "=" + quoted(value))
            elif one["in"] == "header":
                headers[one["name"]] = header_safe(value)
        if draw(st.integers(0, 9)) == 0:
            query.append(quoted(draw(text_strategy())) + "=" + quoted(draw(text_strategy())))
        body = None
        if "requestBody" in operation or draw(st.integers(0, 9)) == 0:
            headers["Content-Type"], body = draw(body_strategy(document, operation, ids))
        return target + ("?" + "&".join(query) if query else ""), headers, body

    return make()


def fill(service):
    """A subject with scans, bones and a model: ids that lead somewhere."""
    subject = service.post("/v1/subjects", b'{"region": "knee"}')["id"]
    return [subject, "sub_none", "mdl_none", "job_none"]


def fuzz(service, path, method, operation, ids, examples, number):
    label = f"{method.upper()} {path}"

    @seed(number)
    @settings(max_examples=examples, deadline=None, database=None, phases=[Phase.generate, Phase.shrink],
              suppress_health_check=list(HealthCheck))
    @given(request_strategy(service, path, method, operation, ids))
    def run(request):
        target, headers, body = request
        check_answer(service, operation, f"{label} as {target[:200]!r}", service.send(method.upper(), target, body, headers))

    run()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("url")
    parser.add_argument("--examples", type=int, default=25)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=0, help="go round again, with other seeds, for so long")
    parser.add_argument("--id", action="append", default=[], help="an id of the service to draw from")
    arguments = parser.parse_args()
    service = Service(arguments.url)
    ids = fill(service) + arguments.id
    end, number, failures = time.monotonic() + arguments.seconds, arguments.seed, 0
    while True:
        for path, item in service.document["paths"].items():
            for method in METHODS:
                if method not in item:
                    continue
                try:
                    fuzz(service, path, method, item[method], ids, arguments.examples, number)
                except Exception as error:  # the rest of the operations is looked at too
                    failures += 1
                    print(f"{method.upper()} {path}: {type(error).__name__}: {error}", file=sys.stderr)
        if service.send("GET", "/healthz")[0] != 200:
            raise SystemExit("the service is no longer healthy")
        number += 1
        if time.monotonic() >= end or failures:
            break
    print(f"{service.sent} requests, statuses {dict(sorted(service.statuses.items()))}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
