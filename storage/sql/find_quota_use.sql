SELECT bytes FROM quota_use WHERE who = ?1 AND day = ?2
