-- Running jobs, and queued ones that are claimed before one of priority ?1 and seq ?2.
SELECT seq, id, kind, model, state, attempt, max_attempts, cancel_requested, stage, progress, error, result,
       created_ms, started_ms, finished_ms, priority, work, batch FROM job
 WHERE state = 'running' OR (state = 'queued' AND (priority > ?1 OR (priority = ?1 AND seq < ?2)))
