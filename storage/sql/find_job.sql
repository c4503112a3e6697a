SELECT seq, id, kind, model, state, attempt, max_attempts, cancel_requested, stage, progress, error, result,
       created_ms, started_ms, finished_ms, priority, work, batch, subject,
       (SELECT name FROM subject WHERE id = job.subject) FROM job WHERE id = ?1 AND (?2 IS NULL OR project = ?2)
