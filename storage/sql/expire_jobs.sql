-- Jobs whose worker has died or fallen silent: back in the queue, or ended. ?2: out of attempts, ?3: three workers lost,
-- ?4: now by the steady clock, which leases go by; it begins anew when the machine does, so what ends far from now (?5)
-- is of before.
UPDATE job SET workers_lost = workers_lost + 1, lease_token = NULL, lease_until_ms = 0,
       state = CASE WHEN cancel_requested THEN 'cancelled'
                    WHEN workers_lost >= 2 OR attempt >= max_attempts THEN 'failed' ELSE 'queued' END,
       finished_ms = CASE WHEN cancel_requested OR workers_lost >= 2 OR attempt >= max_attempts THEN ?1 END,
       error = CASE WHEN cancel_requested THEN NULL WHEN workers_lost >= 2 THEN ?3 WHEN attempt >= max_attempts THEN ?2 END
 WHERE state = 'running' AND (lease_until_ms <= ?4 OR lease_until_ms > ?5)
RETURNING id
