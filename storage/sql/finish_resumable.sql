UPDATE resumable SET received = length, location = ?2 WHERE id = ?1
