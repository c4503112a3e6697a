UPDATE webhook_message SET state = ?2, next_ms = ?3, answer = ?4, attempt = attempt + 1 WHERE id = ?1 AND state = 'waiting'
