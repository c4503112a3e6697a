INSERT INTO idempotency (scope, key, request_digest, status, location, body, created_ms)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)
