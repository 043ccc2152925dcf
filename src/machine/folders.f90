!> Folders and the files in them, as a Linux system lists them.
module folders_mod
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, &
    c_null_char, c_ptr
  use libc_mod, only: c_closedir, c_opendir, c_readdir
  use text_mod, only: string_t
  implicit none
  private

  public :: is_folder, list_files

  ! An entry of a 64-bit Linux: number and offset of 8 bytes each, length of 2, kind of 1, name.
  integer, parameter :: place_of_kind = 19, place_of_name = 20
  integer, parameter :: longest_name = 255 !! [byte]
  integer, parameter :: is_link = 10       !! kind of a symbolic link, which may lead back

contains

  !> Whether a path names a folder.
  logical function is_folder(path)
    character(*), intent(in) :: path
    type(c_ptr) :: folder
    integer(c_int) :: status

    folder = c_opendir(path//c_null_char)
    is_folder = c_associated(folder)
    if (is_folder) status = c_closedir(folder)
  end function is_folder

  !> The files of a folder and of those within it whose names have an ending, by their names. Hidden
  !> folders and links to folders are left out.
  recursive subroutine list_files(path, ending, files)
    character(*), intent(in) :: path    !! of the folder
    character(*), intent(in) :: ending  !! '.inp'
    type(string_t), allocatable, intent(out) :: files(:)
    type(string_t), allocatable :: names(:), inner(:)
    integer, allocatable :: kinds(:)
    type(string_t) :: file
    integer :: i

    allocate (files(0))
    call list_entries(path, names, kinds)
    do i = 1, size(names)
      if (names(i)%text(1:1) == '.') cycle
      file%text = path//'/'//names(i)%text
      if (is_folder(file%text)) then
        if (kinds(i) == is_link) cycle
        call list_files(file%text, ending, inner)
        files = [files, inner]
      else if (len(file%text) > len(ending)) then
        if (file%text(len(file%text) - len(ending) + 1:) == ending) files = [files, file]
      end if
    end do
  end subroutine list_files

  !> Names and kinds of a folder's entries, in the order of their names.
  subroutine list_entries(path, names, kinds)
    character(*), intent(in) :: path
    type(string_t), allocatable, intent(out) :: names(:)
    integer, allocatable, intent(out) :: kinds(:)
    character(c_char), pointer :: bytes(:)
    type(c_ptr) :: folder, entry
    type(string_t) :: name
    integer(c_int) :: status
    integer :: i, k, kind

    allocate (names(0), kinds(0))
    folder = c_opendir(path//c_null_char)
    if (.not. c_associated(folder)) return
    do
      entry = c_readdir(folder)
      if (.not. c_associated(entry)) exit
      call c_f_pointer(entry, bytes, [place_of_name + longest_name])
      name%text = ''
      do k = place_of_name, place_of_name + longest_name - 1
        if (bytes(k) == c_null_char) exit
        name%text = name%text//bytes(k)
      end do
      ! Few enough to be put in their place one by one.
      do i = size(names), 1, -1
        if (llt(names(i)%text, name%text)) exit
      end do
      kind = iachar(bytes(place_of_kind))
      names = [names(:i), name, names(i + 1:)]
      kinds = [kinds(:i), kind, kinds(i + 1:)]
    end do
    status = c_closedir(folder)
  end subroutine list_entries

end module folders_mod
