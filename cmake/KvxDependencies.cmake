# Everything that is not ours, one target each. What each is for: docs/dependencies.md.
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenSSL 3.0 REQUIRED)
find_package(TBB 2021 REQUIRED)
find_package(OpenCL REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(SQLite3 REQUIRED)
find_package(SQLiteCpp REQUIRED)
find_package(LibArchive REQUIRED)
find_package(PNG REQUIRED)
find_package(meshoptimizer REQUIRED)
find_library(KVX_TINYGLTF_LIBRARY tinygltf REQUIRED)
find_package(ZLIB REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(NLopt 2.7 REQUIRED)
find_package(GDCM 3.0 REQUIRED)  # ITK's own DICOM library; headers of series are read with it directly
find_package(ITK 5.2 REQUIRED COMPONENTS ITKCommon ITKIOImageBase ITKIONIFTI ITKIONRRD ITKIOMeta ITKIOGDCM)

foreach(library dcmdata oflog ofstd)  # what DICOM is written by
  find_library(KVX_DCMTK_${library} ${library} REQUIRED)
  list(APPEND KVX_DCMTK_LIBRARIES ${KVX_DCMTK_${library}})
endforeach()

add_library(kvx_opencl INTERFACE)
target_link_libraries(kvx_opencl INTERFACE OpenCL::OpenCL)
target_compile_definitions(kvx_opencl INTERFACE CL_HPP_TARGET_OPENCL_VERSION=120 CL_HPP_MINIMUM_OPENCL_VERSION=120
                           CL_TARGET_OPENCL_VERSION=120 CL_HPP_ENABLE_EXCEPTIONS)

find_library(KVX_ZSTD_LIBRARY zstd REQUIRED)
add_library(kvx_zstd INTERFACE)
target_link_libraries(kvx_zstd INTERFACE ${KVX_ZSTD_LIBRARY})

find_library(KVX_CJOSE_LIBRARY cjose REQUIRED)
add_library(kvx_cjose INTERFACE)
target_link_libraries(kvx_cjose INTERFACE ${KVX_CJOSE_LIBRARY})

# One header, obtained and checked by deploy/setup-debian.sh; or bring your own.
set(KVX_HTTPLIB_INCLUDE "${CMAKE_SOURCE_DIR}/third_party/cpp-httplib" CACHE PATH "Folder that holds httplib.h")
if(NOT EXISTS "${KVX_HTTPLIB_INCLUDE}/httplib.h")
  message(FATAL_ERROR "httplib.h is not in ${KVX_HTTPLIB_INCLUDE}: run ./do setup, or set KVX_HTTPLIB_INCLUDE")
endif()
# Its 16,000 lines of implementation, between the two border lines, are compiled once and not in every source that speaks
# HTTP (what the project's own split.py does).
set(KVX_HTTPLIB_SPLIT ${CMAKE_BINARY_DIR}/generated/httplib)
function(kvx_split_httplib)
  file(READ ${KVX_HTTPLIB_INCLUDE}/httplib.h text)
  set(border "// ----------------------------------------------------------------------------\n")
  string(LENGTH "${border}" border_length)
  string(FIND "${text}" "${border}" first)
  string(FIND "${text}" "${border}" second REVERSE)
  if(first EQUAL -1 OR first EQUAL second)
    message(FATAL_ERROR "httplib.h is not the version we know; see docs/dependencies.md")
  endif()
  string(SUBSTRING "${text}" 0 ${first} before)
  math(EXPR begin "${first} + ${border_length}")
  math(EXPR length "${second} - ${begin}")
  string(SUBSTRING "${text}" ${begin} ${length} implementation)
  string(SUBSTRING "${text}" ${second} -1 after)
  string(REPLACE "inline " "" implementation "${implementation}")
  # What goes wrong with one connection, or for lack of memory or files, does not end the service; a listening socket that
  # is gone does.
  set(too_many_files "if (errno == EMFILE) {")
  string(FIND "${implementation}" "${too_many_files}" found)
  if(found EQUAL -1)
    message(FATAL_ERROR "httplib.h is not the version we know; see docs/dependencies.md")
  endif()
  string(REPLACE "${too_many_files}" "if (errno != EBADF && errno != EINVAL && errno != ENOTSOCK) {" implementation
         "${implementation}")
  # A stream reads on beyond a request, so there is one for all requests of a connection: what it has read of the next would
  # be lost, and the rest taken for a request.
  set(one_a_request "  return process_server_socket_core(
      svr_sock, sock, keep_alive_max_count, keep_alive_timeout_sec,
      [&](bool close_connection, bool &connection_closed) {
        SocketStream strm(sock, read_timeout_sec, read_timeout_usec,
                          write_timeout_sec, write_timeout_usec);
        return callback(strm, close_connection, connection_closed);
      })")
  set(one_a_connection "  SocketStream strm(sock, read_timeout_sec, read_timeout_usec, write_timeout_sec, write_timeout_usec);
  return process_server_socket_core(
      svr_sock, sock, keep_alive_max_count, keep_alive_timeout_sec,
      [&](bool close_connection, bool &connection_closed) {
        return callback(strm, close_connection, connection_closed);
      }, &strm)")
  set(wait "while (count > 0 && keep_alive(")
  set(wait_unless_read "while (count > 0 && ((stream && stream->is_readable()) || keep_alive(")
  set(wait_end "keep_alive_timeout_sec)) {\n    auto close_connection")
  set(core_end "time_t keep_alive_timeout_sec, T callback) {\n  assert")
  foreach(known one_a_request wait wait_end core_end)
    string(FIND "${implementation}" "${${known}}" found)
    if(found EQUAL -1)
      message(FATAL_ERROR "httplib.h is not the version we know; see docs/dependencies.md")
    endif()
  endforeach()
  string(REPLACE "${one_a_request}" "${one_a_connection}" implementation "${implementation}")
  string(REPLACE "${wait}" "${wait_unless_read}" implementation "${implementation}")
  string(REPLACE "${wait_end}" "keep_alive_timeout_sec))) {\n    auto close_connection" implementation "${implementation}")
  string(REPLACE "${core_end}" "time_t keep_alive_timeout_sec, T callback, Stream *stream = nullptr) {\n  assert"
         implementation "${implementation}")
  # server/http/connection_watch.h wants to know the connections: what serves one becomes ours to override and to call.
  set(serve_one "bool process_and_close_socket(socket_t sock)")
  foreach(declaration "  virtual ${serve_one};" "  ${serve_one} override;")
    string(FIND "${before}" "${declaration}" found)
    if(found EQUAL -1)
      message(FATAL_ERROR "httplib.h is not the version we know; see docs/dependencies.md")
    endif()
    string(REPLACE "${declaration}" "protected:\n${declaration}" before "${before}")
  endforeach()
  file(CONFIGURE OUTPUT ${KVX_HTTPLIB_SPLIT}/httplib.h CONTENT "@before@@after@" @ONLY)
  file(CONFIGURE OUTPUT ${KVX_HTTPLIB_SPLIT}/httplib.cpp @ONLY
       CONTENT "#include \"httplib.h\"\nnamespace httplib {\n@implementation@}  // namespace httplib\n")
endfunction()
kvx_split_httplib()
add_library(kvx_httplib STATIC ${KVX_HTTPLIB_SPLIT}/httplib.cpp)
target_include_directories(kvx_httplib SYSTEM PUBLIC ${KVX_HTTPLIB_SPLIT})
# A longer queue of connections that wait to be accepted; a request for more ranges than this is refused.
target_compile_definitions(kvx_httplib PUBLIC CPPHTTPLIB_OPENSSL_SUPPORT CPPHTTPLIB_ZLIB_SUPPORT
                           CPPHTTPLIB_LISTEN_BACKLOG=512 CPPHTTPLIB_RANGE_MAX_COUNT=16)
target_compile_options(kvx_httplib PRIVATE -w)  # not ours
target_link_libraries(kvx_httplib PUBLIC OpenSSL::SSL OpenSSL::Crypto ZLIB::ZLIB Threads::Threads)
