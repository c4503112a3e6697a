INSERT INTO job_event (job, at_ms, state, stage, progress, attempt)
SELECT id, ?2, state, stage, progress, attempt FROM job WHERE id = ?1
