-- include line_of_jobs.sql
-- The next in line, if the memory that it declares is free: it is not overtaken by smaller ones, so that it does not wait for
-- ever, and it runs alone where it declares more than all. The attempt counts from here.
UPDATE job SET state = 'running', attempt = attempt + 1, worker = ?2, lease_token = ?3, lease_until_ms = ?4,
               started_ms = coalesce(started_ms, ?1)
 WHERE seq = (SELECT seq FROM line WHERE number = 1)
   AND (need_bytes <= ?5 - (SELECT coalesce(sum(need_bytes), 0) FROM job WHERE state = 'running')
        OR NOT EXISTS (SELECT 1 FROM job WHERE state = 'running'))
RETURNING id, kind, model, (SELECT request FROM job_request WHERE job_request.job = job.id), attempt, work
