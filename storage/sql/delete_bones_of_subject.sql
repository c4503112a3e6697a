DELETE FROM bones WHERE subject = ?1
