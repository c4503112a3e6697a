SELECT message.id, url, secret, type, body, attempt
  FROM webhook_message AS message JOIN webhook ON webhook.id = message.webhook
 WHERE state = 'waiting' AND next_ms <= ?1 ORDER BY next_ms, message.seq LIMIT 1
