UPDATE job SET state = ?3, result = ?4, error = ?5, finished_ms = ?6, lease_token = NULL,
               progress = CASE WHEN ?3 = 'succeeded' THEN 1.0 ELSE progress END
 WHERE id = ?1 AND lease_token = ?2 AND state = 'running'
