INSERT INTO job (id, kind, model, state, priority, max_attempts, created_ms, need_bytes, work, batch, project, subject)
VALUES (?1, ?2, ?3, 'queued', ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)
