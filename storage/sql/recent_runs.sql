SELECT job FROM stage_time WHERE kind = ?1 AND position = 0 ORDER BY seq DESC LIMIT ?2
