-- Messages that would wait longer than any does: the clock was ahead when they were written or postponed. ?1 holds for
-- those that were not tried yet, ?2 for the others.
UPDATE webhook_message SET next_ms = CASE attempt WHEN 0 THEN ?1 ELSE ?2 END
 WHERE state = 'waiting' AND next_ms > CASE attempt WHEN 0 THEN ?1 ELSE ?2 END
