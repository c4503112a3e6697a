DELETE FROM subject WHERE id = ?1
