DELETE FROM model WHERE subject = ?1
