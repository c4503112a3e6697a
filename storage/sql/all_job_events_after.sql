SELECT id, at_ms, state, stage, progress, attempt, job FROM job_event WHERE id > ?1 ORDER BY id LIMIT ?2
