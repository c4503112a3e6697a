-- include line_of_jobs.sql
-- Running jobs, and those in line before the one of seq ?2.
SELECT seq, id, kind, model, state, attempt, max_attempts, cancel_requested, stage, progress, error, result,
       created_ms, started_ms, finished_ms, priority, work, batch, subject,
       (SELECT name FROM subject WHERE id = job.subject) FROM job
 WHERE state = 'running' OR seq IN (SELECT seq FROM line WHERE number < (SELECT number FROM line WHERE seq = ?2))
