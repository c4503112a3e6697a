INSERT INTO resumable (id, subject, kind, parameters, sha256, length, metadata, created_ms, expires_ms)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)
