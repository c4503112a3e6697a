-- Queued jobs that nobody will claim: cancelled just before their worker gave them back, or out of attempts.
UPDATE job SET state = CASE WHEN cancel_requested THEN 'cancelled' ELSE 'failed' END, finished_ms = ?1,
               error = CASE WHEN cancel_requested THEN NULL ELSE ?2 END
 WHERE state = 'queued' AND (cancel_requested OR attempt >= max_attempts)
RETURNING id
