UPDATE job SET stage = ?3, progress = ?4 WHERE id = ?1 AND lease_token = ?2 AND state = 'running'
