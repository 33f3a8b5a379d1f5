// The texts that views show about a VDI.
#ifndef VDIMessage_h
#define VDIMessage_h

#include <vtkTextActor.h>

#include <string>

/// A text in a view, in lines that fit its width. Several of them at a place of a renderer stand below each
/// other.
class vtkVDIMessage : public vtkTextActor {
 public:
  static vtkVDIMessage* New();
  vtkTypeMacro(vtkVDIMessage, vtkTextActor);

  enum class Place {
    Middle,  // at half the height, in place of a picture
    Top,     // over a picture, at its upper edge
    Bottom   // over a picture, small, and centred at its lower edge
  };
  /// Shows the text, or nothing if it is empty.
  void Show(const std::string& text, Place place);
  int RenderOpaqueGeometry(vtkViewport* viewport) override;

 protected:
  vtkVDIMessage();
  ~vtkVDIMessage() override = default;

 private:
  vtkVDIMessage(const vtkVDIMessage&) = delete;
  void operator=(const vtkVDIMessage&) = delete;

  void PutIn(vtkViewport* viewport);

  std::string Text;
  Place At = Place::Middle;
  bool IsNew = false;  // true until the changed text is drawn
};

#endif
