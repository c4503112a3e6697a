-- A job whose worker died is claimable again when its lease runs out. The attempt counts from here.
UPDATE job SET state = 'running', attempt = attempt + 1, worker = ?1, lease_token = ?2, lease_until_ms = ?3,
               started_ms = coalesce(started_ms, ?4)
 WHERE id = (SELECT id FROM job
              WHERE (state = 'queued' OR (state = 'running' AND lease_until_ms <= ?4))
                AND attempt < max_attempts AND cancel_requested = 0 AND not_before_ms <= ?4
              ORDER BY priority DESC, seq LIMIT 1)
RETURNING id, kind, model, request, attempt
