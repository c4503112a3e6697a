-- The next in line, if the memory that it declares is free: it is not overtaken by smaller ones, so that it does not wait for
-- ever, and it runs alone where it declares more than all. The attempt counts from here. The line: the first of each project,
-- then the second of each; of those the one whose project has not begun a job for longest. So is jobs_before.sql.
UPDATE job SET state = 'running', attempt = attempt + 1, worker = ?1, lease_token = ?2, lease_until_ms = ?3,
               started_ms = coalesce(started_ms, ?4)
 WHERE id = (SELECT id FROM (SELECT id, project, seq, row_number() OVER (PARTITION BY project ORDER BY priority DESC, seq) AS place
                               FROM job WHERE state = 'queued' AND not_before_ms <= ?4) AS line
              WHERE place = 1
              ORDER BY (SELECT max(started_ms) FROM job AS begun WHERE begun.project = line.project), seq LIMIT 1)
   AND (need_bytes <= ?5 - (SELECT coalesce(sum(need_bytes), 0) FROM job WHERE state = 'running')
        OR NOT EXISTS (SELECT 1 FROM job WHERE state = 'running'))
RETURNING id, kind, model, (SELECT request FROM job_request WHERE job_request.job = job.id), attempt, work
