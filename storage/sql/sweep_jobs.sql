-- Jobs nobody will claim again: cancelled while their worker was away, or out of attempts.
UPDATE job SET state = CASE WHEN cancel_requested THEN 'cancelled' ELSE 'failed' END, finished_ms = ?1,
               lease_token = NULL, error = CASE WHEN cancel_requested THEN NULL ELSE ?2 END
 WHERE (state = 'running' AND lease_until_ms <= ?1 AND (cancel_requested OR attempt >= max_attempts))
    OR (state = 'queued' AND attempt >= max_attempts)
RETURNING id
