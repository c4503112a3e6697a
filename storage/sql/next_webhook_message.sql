-- The one that has been due longest of the project that comes next after ?2 in the alphabet, round and round.
SELECT message.id, url, secret, type, body, attempt, project
  FROM webhook_message AS message JOIN webhook ON webhook.id = message.webhook
 WHERE state = 'waiting' AND next_ms <= ?1
 ORDER BY project <= ?2, project, next_ms, message.seq LIMIT 1
