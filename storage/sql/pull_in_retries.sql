-- Jobs that would wait beyond ?1, later than any retry does: the clock was ahead when they were told until when.
UPDATE job SET not_before_ms = ?1 WHERE state = 'queued' AND not_before_ms > ?1
