UPDATE job SET lease_until_ms = ?3 WHERE id = ?1 AND lease_token = ?2 AND state = 'running'
RETURNING cancel_requested
