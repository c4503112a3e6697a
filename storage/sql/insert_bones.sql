INSERT INTO bones (id, subject, template, sha256, content, suffix, bytes, facts, created_ms)
VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)
