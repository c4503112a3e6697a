DELETE FROM job WHERE subject = ?1
