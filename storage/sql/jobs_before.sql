-- Running jobs, and queued ones that are claimed before the one of seq ?1 (the line of claim_next_job.sql).
WITH place AS (SELECT seq, project, row_number() OVER (PARTITION BY project ORDER BY priority DESC, seq) AS of_project
                 FROM job WHERE state = 'queued'),
     turn AS (SELECT project, coalesce((SELECT max(started_ms) FROM job AS begun WHERE begun.project = place.project), 0) AS begun_ms
                FROM place WHERE of_project = 1),
     line AS (SELECT seq, row_number() OVER (ORDER BY of_project, begun_ms, seq) AS number FROM place JOIN turn USING (project))
SELECT seq, id, kind, model, state, attempt, max_attempts, cancel_requested, stage, progress, error, result,
       created_ms, started_ms, finished_ms, priority, work, batch, subject,
       (SELECT name FROM subject WHERE id = job.subject) FROM job
 WHERE state = 'running' OR seq IN (SELECT seq FROM line WHERE number < (SELECT number FROM line WHERE seq = ?1))
