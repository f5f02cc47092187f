/// Read by LeakSanitizer where a program is built with it. When a file is damaged or the disk is full, HDF5
/// 1.10 loses memory of its own (its metadata cache, for one), which no caller can give back.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5_serial\n"; }
