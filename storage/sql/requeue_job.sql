-- ?3: 1 gives the attempt back (the worker stopped on request), 0 keeps it counted.
UPDATE job SET state = 'queued', lease_token = NULL, lease_until_ms = 0, attempt = attempt - ?3, not_before_ms = ?4
 WHERE id = ?1 AND lease_token = ?2 AND state = 'running'
