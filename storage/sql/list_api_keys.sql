SELECT id, name, project, scope, secret_sha256, requests_per_minute, bytes_per_day, created_ms, expires_ms, revoked_ms
  FROM api_key ORDER BY seq
