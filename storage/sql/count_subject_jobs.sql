SELECT count(*) FROM job WHERE subject = ?1 AND state IN ('queued', 'running')
