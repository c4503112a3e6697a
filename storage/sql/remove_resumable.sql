DELETE FROM resumable WHERE id = ?1
