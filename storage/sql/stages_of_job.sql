SELECT stage, begin, seconds, work FROM stage_time WHERE job = ?1 ORDER BY position
