DELETE FROM scan WHERE subject = ?1
