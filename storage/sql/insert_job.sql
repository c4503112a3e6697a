INSERT INTO job (id, kind, model, request, state, priority, max_attempts, created_ms, need_bytes, work, batch, project)
VALUES (?1, ?2, ?3, ?4, 'queued', ?5, ?6, ?7, ?8, ?9, ?10, ?11)
