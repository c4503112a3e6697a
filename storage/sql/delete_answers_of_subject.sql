-- Kept answers repeat what the subject was called.
DELETE FROM idempotency
 WHERE instr(scope, ?1) > 0 OR instr(location, ?1) > 0 OR instr(body, ?1) > 0
    OR EXISTS (SELECT 1 FROM model WHERE subject = ?1 AND instr(idempotency.body, model.id) > 0)
