# A room is a folder, a static library kvx_<room>, and all its sources. Adding a file needs no edit here.

# Sources under `folder` become one generated .cpp with a lookup by file name.
function(kvx_embed out folder pattern symbol)
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/${pattern})
  set(generated ${CMAKE_BINARY_DIR}/generated/${symbol}.cpp)
  add_custom_command(OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -DOUT=${generated} -DSYMBOL=${symbol} "-DFILES=${files}"
            -P ${CMAKE_SOURCE_DIR}/cmake/embed_text.cmake
    DEPENDS ${files} ${CMAKE_SOURCE_DIR}/cmake/embed_text.cmake VERBATIM)
  set(${out} ${generated} PARENT_SCOPE)
endfunction()

kvx_embed(KVX_EMBEDDED_KERNELS kernels/cl    "*.cl*"  EmbeddedKernels)
kvx_embed(KVX_EMBEDDED_SQL     storage/sql   "*.sql"  EmbeddedSql)
kvx_embed(KVX_EMBEDDED_SCHEMA  api/schema    "*.json" EmbeddedSchema)
kvx_embed(KVX_EMBEDDED_PAGE    server/page   "*.*"    EmbeddedPage)

# What the API page is made with (deploy/api-page), where set-up could obtain it; without it /docs says so.
set(KVX_API_PAGE ${CMAKE_SOURCE_DIR}/third_party/api-page/node_modules/swagger-ui-dist)
set(KVX_EMBEDDED_API_PAGE ${CMAKE_BINARY_DIR}/generated/EmbeddedApiPage.cpp)
set(api_page_files "")
foreach(file swagger-ui.css swagger-ui-bundle.js)
  if(EXISTS ${KVX_API_PAGE}/${file})
    list(APPEND api_page_files ${KVX_API_PAGE}/${file})
  endif()
endforeach()
add_custom_command(OUTPUT ${KVX_EMBEDDED_API_PAGE}
  COMMAND ${CMAKE_COMMAND} -DOUT=${KVX_EMBEDDED_API_PAGE} -DSYMBOL=EmbeddedApiPage -DFOLDER=${KVX_API_PAGE}
          "-DFILES=swagger-ui.css$<SEMICOLON>swagger-ui-bundle.js" -P ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake
  DEPENDS ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake ${api_page_files} VERBATIM)

function(kvx_room name)
  cmake_parse_arguments(ROOM "" "" "DEPENDS;EXTRA" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${name}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/pipeline/io/|/cli/main.cpp$")
  if(NOT sources)
    add_library(kvx_${name} INTERFACE)
    target_link_libraries(kvx_${name} INTERFACE ${ROOM_DEPENDS})
    return()
  endif()
  add_library(kvx_${name} STATIC ${sources} ${ROOM_EXTRA})
  target_include_directories(kvx_${name} PUBLIC ${CMAKE_SOURCE_DIR})
  target_link_libraries(kvx_${name} PUBLIC ${ROOM_DEPENDS} Threads::Threads PRIVATE kvx_warnings)
  target_precompile_headers(kvx_${name} PRIVATE <Eigen/Dense> <algorithm> <array> <cmath> <cstdint> <filesystem>
    <functional> <map> <memory> <optional> <string> <utility> <vector>)
endfunction()

# The only place that sees ITK, libpng and archives of arrays: slow headers stay behind it.
file(GLOB_RECURSE io_sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/pipeline/io/*.cpp)
if(NOT io_sources)
  message(FATAL_ERROR "pipeline/io is empty")
endif()
add_library(kvx_pipeline_io STATIC ${io_sources})
target_include_directories(kvx_pipeline_io PUBLIC ${CMAKE_SOURCE_DIR})
target_include_directories(kvx_pipeline_io SYSTEM PRIVATE ${ITK_INCLUDE_DIRS} ${GDCM_INCLUDE_DIRS})
target_link_libraries(kvx_pipeline_io PUBLIC kvx_core PRIVATE ${ITK_LIBRARIES} gdcmMSFF gdcmDSED gdcmCommon
                      ${KVX_DCMTK_LIBRARIES} PNG::PNG LibArchive::LibArchive
                      ${KVX_TINYGLTF_LIBRARY} ZLIB::ZLIB nlohmann_json::nlohmann_json kvx_warnings)
