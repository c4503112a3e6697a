// Sixteen numbers at a time.
#define KVX_LANE (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15)

KVX_INLINE bool some16(const int16 is_set) {
  const int8 eight = is_set.lo | is_set.hi;
  const int4 four = eight.lo | eight.hi;
  const int2 two = four.lo | four.hi;
  return (two.x | two.y) < 0;
}
KVX_INLINE int count16(const int16 is_set) {
  const int8 eight = is_set.lo + is_set.hi;
  const int4 four = eight.lo + eight.hi;
  return -(four.x + four.y + four.z + four.w);
}
// A bit per lane that is set.
KVX_INLINE uint bits16(const int16 is_set) {
  const int16 bits = is_set & (int16)(1) << KVX_LANE;
  const int8 eight = bits.lo | bits.hi;
  const int4 four = eight.lo | eight.hi;
  const int2 two = four.lo | four.hi;
  return (uint)(two.x | two.y);
}
KVX_INLINE int smallest_int16(const int16 v) {
  const int8 eight = min(v.lo, v.hi);
  const int4 four = min(eight.lo, eight.hi);
  return min(min(four.x, four.y), min(four.z, four.w));
}
// One instruction each, which fmax and fmin are not: of NaN they give the second.
KVX_INLINE float16 most16(const float16 a, const float16 b) { return a > b ? a : b; }
KVX_INLINE float16 least16(const float16 a, const float16 b) { return a < b ? a : b; }
KVX_INLINE float16 farthest16(const float16 x, const float16 y, const float16 z) {
  return most16(fabs(x), most16(fabs(y), fabs(z)));
}

KVX_INLINE float smallest16(const float16 v) {
  const float8 eight = v.lo < v.hi ? v.lo : v.hi;
  const float4 four = eight.lo < eight.hi ? eight.lo : eight.hi;
  return fmin(fmin(four.x, four.y), fmin(four.z, four.w));
}
