SELECT seq, id, kind, model, state, attempt, max_attempts, cancel_requested, stage, progress, error, result,
       created_ms, started_ms, finished_ms, priority, work, batch, subject,
       (SELECT name FROM subject WHERE id = job.subject) FROM job
 WHERE state = ?4 AND seq < ?1 AND (?3 IS NULL OR project = ?3) ORDER BY seq DESC LIMIT ?2
