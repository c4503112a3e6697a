INSERT INTO api_key (id, name, project, scope, secret_sha256, requests_per_minute, bytes_per_day, created_ms, expires_ms)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)
