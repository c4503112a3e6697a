UPDATE model SET digest = ?2 WHERE id = ?1
