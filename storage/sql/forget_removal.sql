DELETE FROM removal WHERE kind = ?1 AND name = ?2
