-- The last hundred runs of a kind are experience enough.
DELETE FROM stage_time WHERE kind = ?1 AND job NOT IN
  (SELECT job FROM stage_time WHERE kind = ?1 AND position = 0 ORDER BY seq DESC LIMIT 100)
