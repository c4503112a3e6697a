UPDATE resumable SET received = ?2, expires_ms = ?3 WHERE id = ?1
