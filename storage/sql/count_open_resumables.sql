SELECT count(*) FROM resumable WHERE subject = ?1 AND location IS NULL AND expires_ms > ?2
