DELETE FROM job WHERE model IN (SELECT id FROM model WHERE subject = ?1) OR instr(request, ?1) > 0
