SELECT id, at_ms, state, stage, progress, attempt, job FROM job_event WHERE job = ?1 AND id > ?2 ORDER BY id LIMIT ?3
