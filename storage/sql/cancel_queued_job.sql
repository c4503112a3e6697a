UPDATE job SET state = 'cancelled', cancel_requested = 1, finished_ms = ?2 WHERE id = ?1 AND state = 'queued'
